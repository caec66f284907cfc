"""Results as one self-contained document: HTML that needs no network, PDF through a browser."""
