"""What the screens share: sessions, analyses, the bench, and work in the background.

Owns what outlives a screen. It draws nothing.
"""
