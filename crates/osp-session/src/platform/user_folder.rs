use std::path::PathBuf;

/// The folder on a web page for the program's own files, which are stored from one visit to the next.
#[cfg(target_arch = "wasm32")]
pub const USER_FOLDER: &str = "/osp";

/// The folder for the program's own files, per user: `osp` in the folder that the variable `xdg` names, else in
/// `APPDATA`, else `below_home` in the home folder. If none of these is set, `.osp` in the current folder.
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

/// A web page has a single folder.
#[cfg(target_arch = "wasm32")]
pub fn user_folder(_: &str, _: &str) -> PathBuf {
    PathBuf::from(USER_FOLDER)
}
