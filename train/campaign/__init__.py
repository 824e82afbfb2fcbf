"""Campaigns: one validation each of many hands, healthy and faulty, as evidence about the checks."""
