"""Flights from take-off to landing that a battery can last for."""
