"""Views and actions of the page, one module per tab."""
