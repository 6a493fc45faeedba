"""Delivered viscosity in four ways."""
