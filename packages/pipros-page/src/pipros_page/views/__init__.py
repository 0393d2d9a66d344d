"""Views and actions of the page, usually one module per tab."""
