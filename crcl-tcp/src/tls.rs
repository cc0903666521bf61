//! TLS with certificates on both sides, for those who want it.

use std::fmt::Debug;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;

use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use rustls::server::WebPkiClientVerifier;
use rustls::{ClientConnection, RootCertStore, ServerConnection, StreamOwned};
use thiserror::Error;

/// Both directions of a connection, plain or encrypted.
pub(crate) trait Stream: Read + Write + Send + Debug {}

impl<T: Read + Write + Send + Debug> Stream for T {}

/// The contents of the three files that each side needs, in PEM.
#[derive(Clone, Debug)]
pub struct TlsFiles {
    /// Its own certificate, followed by those that lead to its authority.
    pub certificate: Vec<u8>,
    /// The private key of its certificate.
    pub key: Vec<u8>,
    /// The certificates of the authorities that the other side's certificate must come from.
    pub authority: Vec<u8>,
}

/// Why TLS cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum TlsError {
    /// A file is not what it should be.
    #[error("{what} in PEM was expected: {cause}")]
    Pem {
        /// What was expected.
        what: &'static str,
        /// What is wrong.
        cause: String,
    },
    /// Certificate, key and authority do not fit together.
    #[error("TLS cannot be set up: {0}")]
    Setup(String),
    /// A server without a name that a certificate could have.
    #[error("{0:?} is no name that a certificate can have")]
    Name(String),
}

fn setup(cause: impl ToString) -> TlsError {
    TlsError::Setup(cause.to_string())
}

impl TlsFiles {
    fn certificates(pem: &[u8]) -> Result<Vec<CertificateDer<'static>>, TlsError> {
        let wrong = |cause: String| TlsError::Pem {
            what: "a certificate",
            cause,
        };
        let read: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(pem).collect();
        let read = read.map_err(|error| wrong(error.to_string()))?;
        if read.is_empty() {
            return Err(wrong("there is none".to_owned()));
        }
        Ok(read)
    }

    fn key(&self) -> Result<PrivateKeyDer<'static>, TlsError> {
        PrivateKeyDer::from_pem_slice(&self.key).map_err(|error| TlsError::Pem {
            what: "a private key",
            cause: error.to_string(),
        })
    }

    fn roots(&self) -> Result<RootCertStore, TlsError> {
        let mut roots = RootCertStore::empty();
        for certificate in Self::certificates(&self.authority)? {
            roots.add(certificate).map_err(setup)?;
        }
        Ok(roots)
    }
}

/// The server's side: who has no certificate of its authority cannot connect.
#[derive(Clone, Debug)]
pub struct TlsServer(Arc<rustls::ServerConfig>);

impl TlsServer {
    /// Makes sense of the files.
    ///
    /// # Errors
    /// [`TlsError`]: a file is not in PEM, or they do not fit together.
    pub fn new(files: &TlsFiles) -> Result<Self, TlsError> {
        let provider = Arc::new(default_provider());
        let roots = Arc::new(files.roots()?);
        let verifier = WebPkiClientVerifier::builder_with_provider(roots, Arc::clone(&provider));
        let config = rustls::ServerConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .map_err(setup)?
            .with_client_cert_verifier(verifier.build().map_err(setup)?)
            .with_single_cert(TlsFiles::certificates(&files.certificate)?, files.key()?)
            .map_err(setup)?;
        Ok(Self(Arc::new(config)))
    }

    /// The encrypted side of a connection that was accepted; the handshake comes with the first read.
    ///
    /// # Errors
    /// What rustls says.
    pub(crate) fn wrap(&self, stream: TcpStream) -> std::io::Result<Box<dyn Stream>> {
        let connection =
            ServerConnection::new(Arc::clone(&self.0)).map_err(std::io::Error::other)?;
        Ok(Box::new(StreamOwned::new(connection, stream)))
    }
}

/// The client's side: the server must have a certificate of its authority.
#[derive(Clone, Debug)]
pub struct TlsClient(Arc<rustls::ClientConfig>);

impl TlsClient {
    /// Makes sense of the files.
    ///
    /// # Errors
    /// [`TlsError`]: a file is not in PEM, or they do not fit together.
    pub fn new(files: &TlsFiles) -> Result<Self, TlsError> {
        let config = rustls::ClientConfig::builder_with_provider(Arc::new(default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(setup)?
            .with_root_certificates(files.roots()?)
            .with_client_auth_cert(TlsFiles::certificates(&files.certificate)?, files.key()?)
            .map_err(setup)?;
        Ok(Self(Arc::new(config)))
    }

    /// The encrypted side of a connection to a server of that name or address.
    ///
    /// # Errors
    /// The name is none, or what rustls says.
    pub(crate) fn wrap(&self, host: &str, stream: TcpStream) -> std::io::Result<Box<dyn Stream>> {
        let name = ServerName::try_from(host.to_owned())
            .map_err(|_| std::io::Error::other(TlsError::Name(host.to_owned())))?;
        let connection =
            ClientConnection::new(Arc::clone(&self.0), name).map_err(std::io::Error::other)?;
        Ok(Box::new(StreamOwned::new(connection, stream)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};

    /// An authority, and what it has signed.
    struct Authority {
        issuer: Issuer<'static, KeyPair>,
        pem: String,
    }

    impl Authority {
        fn new() -> Self {
            let key = KeyPair::generate().unwrap();
            let mut params = CertificateParams::new(Vec::new()).unwrap();
            params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
            let pem = params.self_signed(&key).unwrap().pem();
            Self {
                issuer: Issuer::new(params, key),
                pem,
            }
        }

        /// The files of somebody with a certificate of this authority, who trusts another.
        fn files(&self, trusts: &Self) -> TlsFiles {
            let key = KeyPair::generate().unwrap();
            let params = CertificateParams::new(vec!["127.0.0.1".to_owned()]).unwrap();
            let certificate = params.signed_by(&key, &self.issuer).unwrap();
            TlsFiles {
                certificate: certificate.pem().into_bytes(),
                key: key.serialize_pem().into_bytes(),
                authority: trusts.pem.clone().into_bytes(),
            }
        }
    }

    /// What comes of four bytes to a server and back.
    fn echo(server: &TlsFiles, client: &TlsFiles) -> std::io::Result<[u8; 4]> {
        let (server, client) = (
            TlsServer::new(server).unwrap(),
            TlsClient::new(client).unwrap(),
        );
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let thread = std::thread::spawn(move || {
            let mut stream = server.wrap(listener.accept().unwrap().0).unwrap();
            let mut bytes = [0; 4];
            stream.read_exact(&mut bytes)?;
            stream.write_all(&bytes)
        });
        let mut stream = client
            .wrap("127.0.0.1", TcpStream::connect(address).unwrap())
            .unwrap();
        let mut bytes = [0; 4];
        let got = stream
            .write_all(b"CRCL")
            .and_then(|()| stream.read_exact(&mut bytes));
        drop(stream);
        thread.join().unwrap()?;
        got.map(|()| bytes)
    }

    #[test]
    fn both_sides_must_be_known() {
        let (ours, strange) = (Authority::new(), Authority::new());
        let (server, client) = (ours.files(&ours), ours.files(&ours));
        assert_eq!(&echo(&server, &client).unwrap(), b"CRCL");
        let stranger = strange.files(&ours);
        assert!(echo(&server, &stranger).is_err(), "a client of nobody");
        assert!(
            echo(&strange.files(&ours), &client).is_err(),
            "a server of nobody"
        );
        let wrong = TlsFiles {
            key: Vec::new(),
            ..client.clone()
        };
        assert!(matches!(TlsClient::new(&wrong), Err(TlsError::Pem { .. })));
        let wrong = TlsFiles {
            certificate: b"no certificate".to_vec(),
            ..client
        };
        assert!(matches!(TlsServer::new(&wrong), Err(TlsError::Pem { .. })));
    }
}
