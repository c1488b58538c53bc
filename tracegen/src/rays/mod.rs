//! The companion ray tracer: traces stereo pairs and writes ray traces.
