"""The gallery page: one video per scenario, with the result of each agent."""
