"""Campaigns: many hands, healthy and faulty, each validated once; what they say about the checks themselves."""
