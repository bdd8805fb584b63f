"""Gates that are missed, and why. They stay missed in the record; a test that knows them (KUZURE_KNOWN=1) fails only when
another one is missed, or when one of these is met after all and should leave this list. Keys: the case and what was measured.
Cases written in C++ give their reasons themselves."""

MISSES = {}
