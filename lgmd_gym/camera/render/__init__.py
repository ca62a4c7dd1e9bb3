"""Compiled kernels that render camera frames, and their lookup tables.

Arguments have the same names and types in all kernels: `lens` is a `LENS` record, `look` a `LOOK` record,
`obj` an `OBJECT` record and `objects` an array of them, `layer` a `GroundLayer` or `SolidLayer`, `image` the
light as float32 of shape (height, width) [grey levels], `horizon` the row coordinate of the horizon [px], `k`
the index of a channel.
"""
