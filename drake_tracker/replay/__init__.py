"""A recorded run again, without its world: vision, estimation, link and servo on what was recorded.

run directory ──▶ LogSourceSystem, VideoSource ──▶ the run's own vision, host, link, servo ──▶ log, judge
"""
