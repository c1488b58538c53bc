//! Files that the commands read and write.

use shell::{FileUse, FileUses};

/// Uses of the arguments of `tracegen`; a test compares the table with the command line.
pub const FILES: &FileUses = &[
    (&["supervise"], &["folder", "program"], FileUse::NoFile),
    (
        &[],
        &[
            "hidden_area_mesh",
            "trace",
            "manifest",
            "page",
            "rules",
            "iwer",
            "apitrace",
        ],
        FileUse::Input,
    ),
    (&[], &["scene", "path", "gaze"], FileUse::NamedInput),
    (&[], &["program", "chromium"], FileUse::Program),
    (&[], &["root"], FileUse::InputFolder),
    (
        &["stress", "sweep", "techniques"],
        &["output"],
        FileUse::Folder,
    ),
    (&["man"], &["folder"], FileUse::Folder),
    (
        &[],
        &["output", "image", "list_page", "write_reference"],
        FileUse::Output,
    ),
    (&[], &["modules"], FileUse::FolderOfNewNames),
    (
        &[],
        &[
            "query",
            "camera",
            "hmd",
            "variant",
            "animation",
            "only",
            "adapter",
        ],
        FileUse::NoFile,
    ),
];
