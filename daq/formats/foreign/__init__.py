"""Responses that other programs wrote: taken apart, understood or refused, and made ours."""
