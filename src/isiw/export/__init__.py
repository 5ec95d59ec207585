"""Sessions in the files of others: tables for statistics, and BIDS for sharing."""

from isiw.export.exporting import FORMATS, Exported, export_logs

__all__ = ["FORMATS", "Exported", "export_logs"]
