"""What is normal: how much each stage contributes in a run that goes well."""

NORMAL_ATTEMPT = (0.012, 0.0003, 0.0001, 0.010, 0.0001, 0.003, 0.004)
NORMAL_TRACKING = (0.018, 0.0003, 0.0001, 0.012, 0.0001, 0.009, 0.0)
