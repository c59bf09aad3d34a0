"""Recorded scans: the capture folder, a scanner that records one, a scanner that replays one."""

from burrscan.captures.folder import FolderScanner, read_rig, write_rig
from burrscan.captures.recorder import RecordingScanner

__all__ = ["FolderScanner", "RecordingScanner", "read_rig", "write_rig"]
