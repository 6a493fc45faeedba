"""The commands of ``sdpd``, a file each or a few that are alike: `add_to` adds their parsers.

Their jobs are imported when they are run: options alone must not cost that.
"""
