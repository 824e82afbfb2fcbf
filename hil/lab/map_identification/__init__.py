"""Identification of the actuation map on the routed hand (paper, section "The actuation map")."""
