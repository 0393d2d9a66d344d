"""What browsers can look at and do: one module for each tab of the page."""
