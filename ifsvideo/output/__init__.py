"""Overlay, CSV and every other thing written."""
