"""The page in Chromium. A package, so that all modules share the browser (`chromium`)."""
