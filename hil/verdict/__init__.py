"""Verdict: experiments judged by limits, compared with a baseline and the paper, and the diagnosis of failures."""
