"""The views and actions of the page: one module per tab."""
