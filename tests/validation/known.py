"""Gates that are missed, and why. They stay missed in the record; a test that knows them fails only when something else does,
or when one of them is met after all and should leave this list. Keys are the case and what was measured."""

MISSES = {}
