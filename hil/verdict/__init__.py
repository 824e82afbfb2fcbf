"""The verdict: experiments run and judged by limits, beside a baseline and the paper, and what explains a failure."""
