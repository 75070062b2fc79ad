"""What comes from elsewhere: text, files, folders, child processes, calls that may not return.

Owns the bounds that such things are held to. It knows neither instruments nor responses.
"""
