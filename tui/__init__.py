"""What people touch: the command line and the terminal application.

The top floor. It talks to people and computes nothing itself.
"""
