"""Messages on the page: well-known topics, layouts of types, small pictures, and messages to publish."""
