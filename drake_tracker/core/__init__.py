"""What every subsystem shares: messages, timing, errors, frozen state, logs, paths and progress."""
