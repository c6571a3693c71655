use std::path::PathBuf;

/// The folder of the program's own files on a page, which are kept from one visit to the next.
#[cfg(target_arch = "wasm32")]
pub const USER_FOLDER: &str = "/osp";

/// The program's own folder among the user's: `osp` in the folder that the variable `xdg` names, else in that of Windows, else
/// `below_home`; `.osp` here where none is known.
#[cfg(not(target_arch = "wasm32"))]
pub fn user_folder(xdg: &str, below_home: &str) -> PathBuf {
    let from = |name: &str, rest: &str| {
        std::env::var_os(name).filter(|value| !value.is_empty()).map(|value| PathBuf::from(value).join(rest))
    };
    from(xdg, "osp")
        .or_else(|| from("APPDATA", "osp"))
        .or_else(|| from("HOME", below_home))
        .unwrap_or_else(|| PathBuf::from(".osp"))
}

/// A page has one folder.
#[cfg(target_arch = "wasm32")]
pub fn user_folder(_: &str, _: &str) -> PathBuf {
    PathBuf::from(USER_FOLDER)
}
