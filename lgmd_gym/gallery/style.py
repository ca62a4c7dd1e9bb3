"""How the gallery's page looks, and what plays its films."""

STYLE = """
:root { --ground: #14161a; --card: #1d2026; --ink: #ececec; --faint: #a3a9b4; --sky: #56b4e9; --line:
  #2f343d }
* { box-sizing: border-box }
body { margin: 0; background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, "DejaVu Sans",
  sans-serif }
header, main, footer { max-width: 1320px; margin: 0 auto; padding: 0 24px }
header { padding-top: 32px }
h1 { margin: 0; font-size: 32px }
h2 { margin: 40px 0 4px; font-size: 24px }
h3 { margin: 0; font-size: 18px }
p { margin: 6px 0; max-width: 78ch }
.faint, figcaption { color: var(--faint) }
nav a { margin-right: 20px }
a { color: var(--sky) }
code { font-size: 0.92em; background: #0c0d10; padding: 1px 5px; border-radius: 4px }
.cards { display: grid; gap: 20px; margin-top: 16px; grid-template-columns: repeat(auto-fill,
  minmax(400px, 1fr)) }
article { background: var(--card); border: 1px solid var(--line); border-radius: 10px; overflow: hidden }
article > div { padding: 12px 16px 14px }
video { display: block; width: 100%; aspect-ratio: 16/9; background: #000 }
table { border-collapse: collapse; width: 100%; margin: 8px 0; font-size: 14px }
td, th { text-align: left; padding: 3px 10px 3px 0; border-bottom: 1px solid var(--line); vertical-align:
  top }
th { color: var(--faint); font-weight: 500; white-space: nowrap }
details { font-size: 14px }
summary { cursor: pointer; color: var(--sky) }
.good { color: #56b4e9 }
.bad { color: #f0a060 }
.good::before { content: "✓ " }
.bad::before { content: "✗ " }
.sheet { overflow-x: auto }
.sheet img { width: 240px; image-rendering: pixelated; display: block; border-radius: 4px }
.sheet table { width: auto }
.sheet th { border: 0; vertical-align: middle }
.sheet td { border: 0; padding: 3px 6px 3px 0; vertical-align: middle }
.key { display: grid; grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); gap: 24px; align-items: center
  }
.key img { width: 100%; border-radius: 8px }
.key li { margin: 4px 0 }
footer { padding: 32px 24px; font-size: 14px }
@media (max-width: 800px) { .key { grid-template-columns: 1fr } .cards { grid-template-columns: 1fr } }
"""

SCRIPT = """
for (const film of document.querySelectorAll("video")) {
  film.controls = false;
  film.tabIndex = 0;
  const play = () => { film.controls = true; film.play(); };
  const rest = () => { film.controls = false; film.pause(); };
  film.addEventListener("mouseenter", play);
  film.addEventListener("focus", play);
  film.addEventListener("mouseleave", rest);
  film.addEventListener("blur", rest);
}
"""
