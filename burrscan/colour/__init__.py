"""Scanners in colour: three primaries, three channels, and what mixes them.

A scanner in colour is a :class:`burrscan.scanner.Scanner` whose patterns are (F, H, W, 3) levels, red first,
and whose images are (F, h, w, 3) DN. :class:`burrscan.colour.scanner.MonoScanner` makes a grey scanner of it
that takes three frames in one picture; every strategy runs on that unchanged.
"""
