//! Parameter sweeps: plan, run, resume.
