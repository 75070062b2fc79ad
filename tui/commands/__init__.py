"""One module per verb; each is imported when its verb is called.

A verb checks what the user typed, calls the floors below and prints. Heavy
libraries are imported inside the function, never at the head of the module.
"""
