//! The place of a world: a folder, or an address that the crate `object_store` understands.

use std::{fs, io, ops::Range, path::PathBuf, sync::Arc};

use object_store::{
    ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload, local::LocalFileSystem, path::Path,
};

#[cfg(feature = "worlds-cloud")]
use futures_util::StreamExt;
#[cfg(feature = "worlds-cloud")]
use object_store::{
    ClientOptions, GetOptions, GetResult, ObjectStoreScheme, RetryConfig, aws::AmazonS3Builder,
    http::HttpBuilder,
};

use super::{
    WorldError,
    lock::{Locked, PackLock},
};
use osp_session::small_file::check_regular;

/// Largest number of retries for a server that does not answer.
#[cfg(feature = "worlds-cloud")]
const MOST_RETRIES: usize = 3;
/// Longest total time of these retries.
#[cfg(feature = "worlds-cloud")]
const LONGEST_RETRY: std::time::Duration = std::time::Duration::from_secs(20);
/// Largest memory reserved for the announced size of an answer, bytes; more is reserved as data is received. This size
/// is larger than any block.
#[cfg(feature = "worlds-cloud")]
const RESERVED_BYTES: u64 = 1 << 20;

/// A folder or an address that contains a world, or will contain one.
#[derive(Clone)]
pub struct Place {
    text: String,
    store: Arc<dyn ObjectStore>,
    prefix: Path,
    /// The folder; `None` for an address.
    folder: Option<PathBuf>,
    is_writable: bool,
    /// Runtime for the client of an address; a folder needs none.
    #[cfg(feature = "worlds-cloud")]
    runtime: Option<Arc<tokio::runtime::Runtime>>,
}

impl std::fmt::Debug for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Place").field("text", &self.text).finish_non_exhaustive()
    }
}

/// Whether a missing folder is created.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Folder {
    MustExist,
    MayBeCreated,
}

impl Place {
    /// A place to read from: an existing folder, or (feature `worlds-cloud`) `http://`, `https://` or `s3://`. No request
    /// is sent to a server yet.
    ///
    /// # Errors
    /// The folder does not exist, or the address has another form.
    pub fn to_read(text: &str) -> Result<Self, WorldError> {
        Self::of(text, Folder::MustExist)
    }

    /// A place to write to: a folder, which is created if it does not exist, or (feature `worlds-cloud`) `s3://`.
    ///
    /// # Errors
    /// The folder cannot be created or written to, or the address has another form.
    pub fn to_write(text: &str) -> Result<Self, WorldError> {
        let this = Self::of(text, Folder::MayBeCreated)?;
        match this.is_writable {
            true => Ok(this),
            false => Err(this.unusable("expected a folder or an s3:// address to write to")),
        }
    }

    fn of(text: &str, folder: Folder) -> Result<Self, WorldError> {
        if text.contains("://") {
            return Self::at_address(text);
        }
        let problem = |problem: String| WorldError::Place { place: text.to_owned(), problem };
        let path = PathBuf::from(text);
        match fs::metadata(&path) {
            Ok(data) if data.is_dir() => {}
            Ok(_) => return Err(problem("expected a folder; found a file".to_owned())),
            Err(error) if error.kind() == io::ErrorKind::NotFound && folder == Folder::MayBeCreated => {
                fs::create_dir_all(&path).map_err(|error| problem(error.to_string()))?;
            }
            Err(error) => return Err(problem(error.to_string())),
        }
        let store = LocalFileSystem::new_with_prefix(&path).map_err(|error| problem(innermost(&error)))?;
        Ok(Self {
            text: text.to_owned(),
            // Written data survives a power cut.
            store: Arc::new(store.with_fsync(true)),
            prefix: Path::default(),
            folder: Some(path),
            is_writable: true,
            #[cfg(feature = "worlds-cloud")]
            runtime: None,
        })
    }

    #[cfg(not(feature = "worlds-cloud"))]
    fn at_address(text: &str) -> Result<Self, WorldError> {
        let problem = "expected a folder; an address needs a build with the feature `worlds-cloud`, which this one lacks: \
                       cargo install --path crates/osp-cli --features worlds-cloud";
        Err(WorldError::Place { place: text.to_owned(), problem: problem.to_owned() })
    }

    #[cfg(feature = "worlds-cloud")]
    fn at_address(text: &str) -> Result<Self, WorldError> {
        let problem = |problem: String| WorldError::Place { place: text.to_owned(), problem };
        let url = url::Url::parse(text).map_err(|error| problem(error.to_string()))?;
        if !["http", "https", "s3"].contains(&url.scheme()) {
            return Err(problem(
                "expected a folder, or an address with http://, https:// or s3://".to_owned(),
            ));
        }
        let failed = |error: object_store::Error| problem(innermost(&error));
        let (scheme, prefix) = ObjectStoreScheme::parse(&url).map_err(|error| problem(error.to_string()))?;
        let retry =
            RetryConfig { max_retries: MOST_RETRIES, retry_timeout: LONGEST_RETRY, ..RetryConfig::default() };
        let store: Arc<dyn ObjectStore> = match scheme {
            // Keys, region and endpoint come from the usual variables (AWS_ACCESS_KEY_ID, ...).
            ObjectStoreScheme::AmazonS3 => {
                let s3 = AmazonS3Builder::from_env().with_url(text).with_allow_http(true).with_retry(retry);
                Arc::new(s3.build().map_err(failed)?)
            }
            ObjectStoreScheme::Http => {
                let server = HttpBuilder::new().with_url(&url[..url::Position::BeforePath]).with_retry(retry);
                let options = ClientOptions::new().with_allow_http(true);
                Arc::new(server.with_client_options(options).build().map_err(failed)?)
            }
            _ => {
                return Err(problem("expected http://, https:// or s3://; found another service".to_owned()));
            }
        };
        // Connections belong to the runtime's threads, so that any thread may use them again.
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        Ok(Self {
            text: text.to_owned(),
            store,
            prefix,
            folder: None,
            is_writable: url.scheme() == "s3",
            runtime: Some(Arc::new(runtime.map_err(|error| problem(error.to_string()))?)),
        })
    }

    /// The folder or address, as the caller gave it.
    pub fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn unusable(&self, problem: &str) -> WorldError {
        WorldError::Place { place: self.text.clone(), problem: problem.to_owned() }
    }

    /// The full name of an object, for messages.
    pub(super) fn name_of(&self, object: &str) -> String {
        format!("{}/{object}", self.text.trim_end_matches('/'))
    }

    fn path_of(&self, object: &str) -> Path {
        object.split('/').fold(self.prefix.clone(), |path, part| path.join(part))
    }

    fn wait<T>(&self, work: impl Future<Output = T>) -> T {
        #[cfg(feature = "worlds-cloud")]
        if let Some(runtime) = &self.runtime {
            return runtime.block_on(work);
        }
        pollster::block_on(work)
    }

    fn failed(&self, object: &str, error: &object_store::Error) -> WorldError {
        WorldError::Object { object: self.name_of(object), problem: innermost(error) }
    }

    /// Locks the place for a pack, until the lock is dropped. `None` if locks do not exist: at an
    /// address, or in a file system without locks.
    pub(super) fn lock(&self) -> Result<Option<PackLock>, WorldError> {
        let Some(folder) = &self.folder else { return Ok(None) };
        match PackLock::take(folder).map_err(|error| self.unusable(&error.to_string()))? {
            Locked::Taken(lock) => Ok(Some(lock)),
            Locked::Unknown => Ok(None),
            Locked::Busy => Err(WorldError::Busy { place: self.text.clone() }),
        }
    }

    /// Refuses pipes and devices in a folder, because a pipe would wait for a writer, and a device might never end.
    fn check_regular(&self, object: &str) -> Result<(), WorldError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        match check_regular(&folder.join(object)) {
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                Err(WorldError::Object { object: self.name_of(object), problem: error.to_string() })
            }
            // Other errors are reported when the object is read.
            _ => Ok(()),
        }
    }

    /// The contents of an object; `None` if it does not exist.
    pub(super) fn read(&self, object: &str, most_bytes: u64) -> Result<Option<Vec<u8>>, WorldError> {
        self.check_regular(object)?;
        let path = self.path_of(object);
        let bytes = self.wait(async {
            let found = self.store.get(&path).await?;
            let bytes = found.meta.size;
            if bytes > most_bytes {
                return Ok(Err(bytes));
            }
            #[cfg(feature = "worlds-cloud")]
            if self.folder.is_none() {
                return body(found, bytes).await.map(Ok);
            }
            found.bytes().await.map(|bytes| Ok(bytes.to_vec()))
        });
        match bytes {
            Ok(Ok(bytes)) => Ok(Some(bytes)),
            Ok(Err(found)) => Err(WorldError::Damaged {
                object: self.name_of(object),
                byte: most_bytes,
                expected: format!("the end: at most {most_bytes} bytes"),
                found: format!("{found} bytes"),
            }),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(self.failed(object, &error)),
        }
    }

    /// A part of an object. Returns fewer bytes than requested if the object ends.
    pub(super) fn read_range(
        &self,
        object: &str,
        range: Range<u64>,
    ) -> Result<impl std::ops::Deref<Target = [u8]> + use<>, WorldError> {
        self.check_regular(object)?;
        let path = self.path_of(object);
        #[cfg(feature = "worlds-cloud")]
        if self.folder.is_none() {
            let most_bytes = range.end - range.start;
            let options = GetOptions { range: Some(range.into()), ..GetOptions::default() };
            let read = async { body(self.store.get_opts(&path, options).await?, most_bytes).await };
            return self.wait(read).map(Into::into).map_err(|error| self.failed(object, &error));
        }
        let found = self.wait(self.store.get_range(&path, range));
        found.map_err(|error| self.failed(object, &error))
    }

    /// Whether the object exists.
    pub(super) fn holds(&self, object: &str) -> Result<bool, WorldError> {
        match self.wait(self.store.head(&self.path_of(object))) {
            Ok(_) => Ok(true),
            Err(object_store::Error::NotFound { .. }) => Ok(false),
            Err(error) => Err(self.failed(object, &error)),
        }
    }

    /// Writes an object, completely or not at all, and replaces an existing object.
    pub(super) fn replace(&self, object: &str, bytes: Vec<u8>) -> Result<(), WorldError> {
        let path = self.path_of(object);
        let put = self.store.put(&path, PutPayload::from(bytes));
        self.wait(put).map(drop).map_err(|error| self.failed(object, &error))
    }

    /// Writes an object, completely or not at all, unless it exists.
    pub(super) fn create(&self, object: &str, bytes: Vec<u8>) -> Result<(), WorldError> {
        let options = PutOptions::from(PutMode::Create);
        let path = self.path_of(object);
        match self.wait(self.store.put_opts(&path, PutPayload::from(bytes), options)) {
            Ok(_) => Ok(()),
            Err(object_store::Error::AlreadyExists { .. } | object_store::Error::Precondition { .. }) => {
                Err(WorldError::Exists { place: self.text.clone() })
            }
            Err(error) => Err(self.failed(object, &error)),
        }
    }

    /// The names of the objects in a folder of the place.
    pub(super) fn list(&self, folder: &str) -> Result<Vec<String>, WorldError> {
        let path = self.path_of(folder);
        let found = self.wait(self.store.list_with_delimiter(Some(&path)));
        let found = found.map_err(|error| self.failed(folder, &error))?;
        let name = |path: &Path| path.filename().map(|name| format!("{folder}/{name}"));
        Ok(found.objects.iter().filter_map(|object| name(&object.location)).collect())
    }

    pub(super) fn remove(&self, object: &str) -> Result<(), WorldError> {
        match self.wait(self.store.delete(&self.path_of(object))) {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(self.failed(object, &error)),
        }
    }
}

/// The body of a server's answer, if it has at most `most_bytes` bytes. Its headers may announce less than the server
/// sends.
#[cfg(feature = "worlds-cloud")]
async fn body(found: GetResult, most_bytes: u64) -> object_store::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(most_bytes.min(RESERVED_BYTES) as usize);
    let mut pieces = found.into_stream();
    while let Some(piece) = pieces.next().await {
        let piece = piece?;
        if bytes.len() as u64 + piece.len() as u64 > most_bytes {
            let source = format!("expected an answer of at most {most_bytes} bytes; found more").into();
            return Err(object_store::Error::Generic { store: "HTTP", source });
        }
        bytes.extend_from_slice(&piece);
    }
    Ok(bytes)
}

/// The innermost cause of an error: the message of the system or the server.
fn innermost(error: &(dyn std::error::Error + 'static)) -> String {
    std::iter::successors(Some(error), |&error| error.source())
        .last()
        .map_or_else(String::new, ToString::to_string)
}
