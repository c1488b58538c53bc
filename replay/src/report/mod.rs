//! Tables, plots, JSON, CSV and the HTML report.
