"""Messages on the page: decoders, descriptions of message types, small pictures, and messages to publish."""
