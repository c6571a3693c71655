//! Reads the contents or the path of a URI in a glTF file.

use std::path::{Component, Path, PathBuf};

use base64::{
    Engine as _,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};

use percent_encoding::percent_decode_str;

use crate::recording::{error::Mismatch, import::lines::shown};

/// Base64 with optional padding, because some writers omit the padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes of a `data:` URI; `None` for another URI.
pub(super) fn data(uri: &str) -> Option<Result<Vec<u8>, Mismatch>> {
    let content = uri.strip_prefix("data:")?;
    let decoded = content
        .split_once(',')
        .filter(|(kind, _)| kind.ends_with(";base64"))
        .ok_or_else(|| Mismatch::new("data as `data:…;base64,…`", shown(uri)))
        .and_then(|(_, text)| {
            BASE64
                .decode(text)
                .map_err(|error| Mismatch::new("a data URI in base64", format!("{error} of {}", shown(uri))))
        });
    Some(decoded)
}

const EXPECTED: &str = "the URI of a buffer in the same folder or below";

/// The folder of a model. The model may refer to files in it only.
pub(in super::super) fn folder(model: &Path) -> &Path {
    model.parent().unwrap_or(Path::new(""))
}

/// The error of a URI that leads out of the model's folder through a symbolic link.
pub(super) fn leads_out(uri: &str) -> Mismatch {
    Mismatch::new(EXPECTED, format!("{}, a link that leads out of the folder", shown(uri)))
}

/// The path of a relative URI in the folder of `beside` or below it. Symbolic links are not resolved; the caller checks
/// them when it opens the file.
pub(in super::super) fn file(uri: &str, beside: &Path) -> Result<PathBuf, Mismatch> {
    let refuse = || Mismatch::new(EXPECTED, shown(uri));
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| refuse())?;
    let relative = Path::new(decoded.as_ref());
    let is_plain = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if decoded.is_empty() || decoded.contains(['\0', ':', '\\']) || !relative.components().all(is_plain) {
        return Err(refuse());
    }
    Ok(folder(beside).join(relative))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_reads_its_own_folder_and_no_other() {
        let model = Path::new("models/a.gltf");
        let path = |uri| file(uri, model).ok();
        assert_eq!(path("a.bin"), Some(PathBuf::from("models/a.bin")));
        assert_eq!(path("./parts/a%20b.bin"), Some(PathBuf::from("models/./parts/a b.bin")));
        // Some writers do not escape a percent sign.
        assert_eq!(path("a%.bin"), Some(PathBuf::from("models/a%.bin")));
        for uri in ["", "/etc/passwd", "../a.bin", "x/../../a.bin", "http://a/b", "C:\\a", "%2e%2e/a", "a%00"]
        {
            assert_eq!(path(uri), None, "{uri}");
        }
    }

    #[test]
    fn data_uris() {
        let bytes = |uri| data(uri).map(|outcome| outcome.ok());
        assert_eq!(bytes("data:application/octet-stream;base64,AAEC/w=="), Some(Some(vec![0, 1, 2, 255])));
        assert_eq!(bytes("data:;base64,AAEC/w"), Some(Some(vec![0, 1, 2, 255])));
        assert_eq!(bytes("data:;base64,?"), Some(None));
        assert_eq!(bytes("data:text/plain,hello"), Some(None));
        assert_eq!(bytes("a.bin"), None);
    }
}
