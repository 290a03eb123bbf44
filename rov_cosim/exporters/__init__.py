"""Exports of components as FMUs; no exporter knows a component by name."""
