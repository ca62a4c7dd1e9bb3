"""The gallery page: one film per scenario, with the result of each agent."""
