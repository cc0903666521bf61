//! Makes the certificates of a fleet, and the router's configuration.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};

use crate::failure::Failure;
use crate::rights::{Holder, Role, configuration};

const DAY: Duration = Duration::from_secs(24 * 3600);

/// How long the authority holds (days).
const AUTHORITY_DAYS: u32 = 20 * 365;

/// Make certificates for cells, people and programs, and the router's configuration
///
/// Writes a folder for each into DIR: router, cell.NAME, viewer.NAME, operator.NAME, plant.NAME.
/// Copy each to its machine and nowhere else; DIR/authority stays where it is. A viewer reads; an
/// operator also pauses, stops, resumes and sets the speed; a plant sends programs and stops. The
/// command may be given again: it adds, and makes anew what it names. Who loses its folder in DIR loses
/// its rights as soon as the router runs with the new configuration.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Keys {
    /// Where the folders are
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// A cell, the first part of the names of its arms
    #[arg(long, value_name = "NAME")]
    cell: Vec<String>,
    /// Who may read
    #[arg(long, value_name = "NAME")]
    viewer: Vec<String>,
    /// Who may read, pause, stop, resume and set the speed
    #[arg(long, value_name = "NAME")]
    operator: Vec<String>,
    /// Who may read, send programs and stop
    #[arg(long, value_name = "NAME")]
    plant: Vec<String>,
    /// Name or address of the router's machine, as in tls/HOST:PORT; makes the router's certificate
    /// anew [default: localhost, 127.0.0.1 and ::1]
    #[arg(long, value_name = "HOST")]
    host: Vec<String>,
    /// How long the certificates hold; the links close when they end
    #[arg(long, value_name = "DAYS", default_value_t = 825,
        value_parser = clap::value_parser!(u32).range(1..=7300))]
    days: u32,
}

impl Keys {
    /// Makes what is asked for, then the configuration for all that is there.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let mut named = Vec::new();
        let lists = [&self.cell, &self.viewer, &self.operator, &self.plant];
        for (role, names) in Role::ALL.into_iter().zip(lists) {
            for name in names {
                named.push(Holder::new(role, name).map_err(Failure::Usage)?);
            }
        }
        make_folder(&self.folder)?;
        let issuer = authority(&self.folder.join("authority"))?;
        let router = self.folder.join("router");
        if !self.host.is_empty() || !router.join("cert.pem").is_file() {
            let usual = ["localhost", "127.0.0.1", "::1"].map(str::to_owned);
            let hosts = if self.host.is_empty() {
                usual.to_vec()
            } else {
                self.host.clone()
            };
            self.sign(&router, ("router", hosts), &issuer)?;
        }
        for holder in &named {
            let name = holder.to_string();
            self.sign(&self.folder.join(&name), (&name, Vec::new()), &issuer)?;
        }
        let holders = present(&self.folder)?;
        let text = serde_json::to_string_pretty(&configuration(&holders)?).map_err(|cause| {
            Failure::Unreadable(format!("cannot write the configuration: {cause}"))
        })?;
        write(&router.join("router.json5"), &text, 0o644)?;
        say(&format!(
            "canter-fleet: {} certificates in {}; start the router again",
            holders.len() + 1,
            self.folder.display()
        ))
    }

    /// Makes a folder with key, certificate and the authority's certificate.
    fn sign(
        &self,
        folder: &Path,
        (name, hosts): (&str, Vec<String>),
        issuer: &Issuer<'static, KeyPair>,
    ) -> Result<(), Failure> {
        make_folder(folder)?;
        let is_server = !hosts.is_empty();
        let mut params = CertificateParams::new(hosts)
            .map_err(|cause| Failure::Usage(format!("{name}: {cause}")))?;
        params.distinguished_name.push(DnType::CommonName, name);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![if is_server {
            ExtendedKeyUsagePurpose::ServerAuth
        } else {
            ExtendedKeyUsagePurpose::ClientAuth
        }];
        params.use_authority_key_identifier_extension = true;
        hold_for(&mut params, self.days);
        let key = KeyPair::generate().map_err(not_made)?;
        let certificate = params.signed_by(&key, issuer).map_err(not_made)?;
        let above = folder.parent().unwrap_or(folder);
        let authority = read(&above.join("authority/cert.pem"))?;
        write(&folder.join("authority.pem"), &authority, 0o644)?;
        write(&folder.join("cert.pem"), &certificate.pem(), 0o644)?;
        write(&folder.join("key.pem"), &key.serialize_pem(), 0o600)
    }
}

/// A line for who started it.
fn say(line: &str) -> Result<(), Failure> {
    writeln!(std::io::stderr().lock(), "{line}")
        .map_err(|cause| Failure::Unreadable(cause.to_string()))
}

/// The certificates of a folder, by the names of their folders.
fn present(folder: &Path) -> Result<Vec<Holder>, Failure> {
    let listed = fs::read_dir(folder).map_err(|cause| unreadable(folder, &cause))?;
    let mut holders: Vec<Holder> = listed
        .flatten()
        .filter(|entry| entry.path().join("cert.pem").is_file())
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .collect();
    holders.sort();
    Ok(holders)
}

/// The authority of a folder, made where there is none.
fn authority(folder: &Path) -> Result<Issuer<'static, KeyPair>, Failure> {
    let mut params = CertificateParams::new(Vec::new()).map_err(not_made)?;
    params
        .distinguished_name
        .push(DnType::CommonName, "Canter fleet authority");
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    hold_for(&mut params, AUTHORITY_DAYS);
    let key_file = folder.join("key.pem");
    if key_file.exists() {
        let key = KeyPair::from_pem(&read(&key_file)?)
            .map_err(|cause| Failure::Unreadable(format!("{}: {cause}", key_file.display())))?;
        return Ok(Issuer::new(params, key));
    }
    make_folder(folder)?;
    let key = KeyPair::generate().map_err(not_made)?;
    let certificate = params.self_signed(&key).map_err(not_made)?;
    write(&folder.join("cert.pem"), &certificate.pem(), 0o644)?;
    write(&key_file, &key.serialize_pem(), 0o600)?;
    Ok(Issuer::new(params, key))
}

/// From yesterday, as clocks differ, for some days.
fn hold_for(params: &mut CertificateParams, days: u32) {
    let now = SystemTime::now();
    params.not_before = (now - DAY).into();
    params.not_after = (now + DAY * days).into();
}

fn not_made(cause: rcgen::Error) -> Failure {
    Failure::Unreadable(format!("cannot make a certificate: {cause}"))
}

fn unreadable(path: &Path, cause: &std::io::Error) -> Failure {
    Failure::Unreadable(format!("{}: {cause}", path.display()))
}

/// Makes a folder for this user alone.
fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(path)
        .map_err(|cause| unreadable(path, &cause))
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|cause| unreadable(path, &cause))
}

/// Writes a file as a whole: under another name first.
fn write(path: &Path, text: &str, mode: u32) -> Result<(), Failure> {
    let draft = path.with_extension("new");
    let write = || {
        // What an ended run left may be readable for others.
        let _ = fs::remove_file(&draft);
        let mut file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .mode(mode)
            .open(&draft)?;
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        fs::rename(&draft, path)
    };
    write().map_err(|cause| unreadable(path, &cause))
}
