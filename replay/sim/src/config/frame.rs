//! The machine around the texture units: the `[frame]` table of a configuration.

use super::{ConfigError, accept, settings};

settings! {
    /// The machine around the texture units, for the traffic of a whole frame.
    #[derive(Eq)]
    pub struct FrameConfig in "frame." {
        /// How the frame is rendered.
        pub machine: FrameMachine = FrameMachine::TileBased;
        /// Read and shade the vertices of both eyes once. Positions are still written per eye.
        pub multiview: bool = false;
        /// Compose layers, then read each picture in the lens warp and write the display's.
        pub composition: bool = true;
        /// Bytes per pixel of a colour attachment.
        pub color_bytes: u32 = 4, in 1..=64;
        /// Size of colour pictures in memory after lossless compression, in thousandths of the
        /// uncompressed size; `--picture` measures it. Not for an immediate machine.
        #[serde(skip_serializing_if = "is_uncompressed")]
        pub color_compressed_permille: u32 = 1000, in 1..=1000;
        /// Bytes per pixel of a depth attachment.
        pub depth_bytes: u32 = 4, in 1..=64;
        /// Bytes per pixel of the G-buffer.
        pub g_buffer_bytes: u32 = 16, in 1..=64;
        /// Samples per pixel. A tile-based machine resolves them on chip.
        pub samples: u32 = 1;
        /// Write the depth of pictures and layers to memory. Depth of shadow maps is always written.
        pub store_depth: bool = false;
        /// Line size in bytes of all caches except the texture caches.
        pub line_bytes: u32 = 64;
        /// Shaded vertices kept for reuse within a draw (first in, first out).
        pub post_transform_entries: u32 = 32, in 3..=4096;
        /// Size of the vertex fetch cache in bytes (4-way LRU).
        pub vertex_cache_bytes: u64 = 8 << 10;
        /// Bytes per shaded vertex in addition to its 16-byte position.
        pub varying_bytes: u32 = 32, in 0..=1024;
        /// Size of each core's cache for shaded vertices in bytes (4-way LRU).
        pub shaded_vertex_cache_bytes: u64 = 16 << 10;
        /// Bytes per entry of a primitive list.
        pub list_entry_bytes: u32 = 4, in 1..=64;
        /// Size in bytes of the colour cache and of the depth cache of each core of an immediate
        /// machine (4-way LRU, write-back).
        pub pixel_cache_bytes: u64 = 16 << 10;
    }
}

fn is_uncompressed(permille: &u32) -> bool {
    *permille == 1000
}

impl FrameConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let line = self.line_bytes;
        accept(
            [32, 64, 128].contains(&line),
            "frame.line_bytes",
            "32, 64 or 128",
            line,
        )?;
        accept(
            [1, 2, 4, 8].contains(&self.samples),
            "frame.samples",
            "1, 2, 4 or 8",
            self.samples,
        )?;
        self.check_ranges()?;
        accept(
            self.machine != FrameMachine::Immediate || self.color_compressed_permille == 1000,
            "frame.color_compressed_permille",
            "1000 on an immediate machine",
            self.color_compressed_permille,
        )?;
        for (key, bytes) in [
            ("frame.vertex_cache_bytes", self.vertex_cache_bytes),
            (
                "frame.shaded_vertex_cache_bytes",
                self.shaded_vertex_cache_bytes,
            ),
            ("frame.pixel_cache_bytes", self.pixel_cache_bytes),
        ] {
            let lines = bytes / u64::from(line);
            let is_whole = bytes.is_multiple_of(line.into()) && lines.is_power_of_two();
            accept(
                is_whole && (4..=1 << 16).contains(&lines),
                key,
                "4 to 65536 lines in a power-of-two number of 4-way sets",
                bytes,
            )?;
        }
        Ok(())
    }
}

crate::choices! { #[non_exhaustive] FrameMachine = "How a frame is rendered.", default TileBased:
    TileBased = "tile-based", "Tile by tile on chip. A G-buffer, if the scene needs one, stays in pixel-local storage.";
    TileBasedGBuffer = "tile-based-g-buffer", "Tile by tile. The G-buffer is written to memory and read back.";
    Immediate = "immediate", "Colour and depth go through their own caches; shaded vertices stay on chip.";
}
