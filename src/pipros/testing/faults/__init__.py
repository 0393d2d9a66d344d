"""A proxy that disturbs what nodes say to each other, and what checks that the nodes bear it."""
