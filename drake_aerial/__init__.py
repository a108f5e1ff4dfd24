"""Contacts for cable-suspended aerial transport: learnt from one demonstration, transferred, and flown in Drake."""

__version__ = "0.1.0"
