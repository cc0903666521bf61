//! The files of TLS on the command line.

use clap::Args;
use crcl_tcp::{TlsClient, TlsError, TlsFiles, TlsServer};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::input;

/// Encryption, with certificates on both sides.
#[derive(Args, Clone, Debug)]
pub(crate) struct TlsOption {
    /// Encrypt with TLS; the other side needs a certificate of the authority. Files in PEM: own
    /// certificate, own key, certificate of the authority
    #[arg(long, num_args = 3, value_names = ["CERTIFICATE", "KEY", "AUTHORITY"])]
    tls: Option<Vec<String>>,
}

impl TlsOption {
    /// The server's side, if TLS is asked for.
    ///
    /// # Errors
    /// [`Exit::Unreadable`]: a file is missing or is not what it should be.
    pub(crate) fn server(&self) -> Result<Option<TlsServer>, Failure> {
        self.with(TlsServer::new)
    }

    /// The client's side, if TLS is asked for.
    ///
    /// # Errors
    /// As [`Self::server`].
    pub(crate) fn client(&self) -> Result<Option<TlsClient>, Failure> {
        self.with(TlsClient::new)
    }

    fn with<T>(&self, make: fn(&TlsFiles) -> Result<T, TlsError>) -> Result<Option<T>, Failure> {
        let Some([certificate, key, authority]) = self.tls.as_deref() else {
            return Ok(None);
        };
        let files = TlsFiles {
            certificate: input::bytes(certificate)?,
            key: input::bytes(key)?,
            authority: input::bytes(authority)?,
        };
        let made = make(&files).map_err(|error| Failure::new(Exit::Unreadable, error));
        made.map(Some)
    }
}
