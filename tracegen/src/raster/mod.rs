//! Captures texture samples: a stereo raster pass through a Mesa driver.
