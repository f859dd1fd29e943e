"""The page: one HTML file with the video, a timeline, a table of objects and plots of how they move."""

from ifsvideo.report.sink import ReportSink, video_beside

__all__ = ["ReportSink", "video_beside"]
