from .failure import failure_reason as failure_reason
