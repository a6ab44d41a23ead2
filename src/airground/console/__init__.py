"""The operator's console: a page in the browser, and the server that joins it to a session."""
