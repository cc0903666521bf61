//! TLS through the command line: `canter serve crcl --tls` and `canter crcl send --tls`.

use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};
use tempfile::TempDir;

use crate::canter::command;
use crate::crcl_client::Scene;

fn file(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// An authority with a certificate that it has signed: own certificate, own key, authority.
fn signed(folder: &TempDir, name: &str) -> [String; 3] {
    let key = KeyPair::generate().unwrap();
    let mut params = CertificateParams::new(Vec::new()).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let authority = params.self_signed(&key).unwrap().pem();
    let issuer = Issuer::new(params, key);
    let own = KeyPair::generate().unwrap();
    let params = CertificateParams::new(vec!["127.0.0.1".to_owned()]).unwrap();
    let certificate = params.signed_by(&own, &issuer).unwrap().pem();
    [
        file(folder, &format!("{name}.pem"), &certificate),
        file(folder, &format!("{name}.key"), &own.serialize_pem()),
        file(folder, &format!("{name}-authority.pem"), &authority),
    ]
}

const PROGRAM: &str = "InitCanon()\nSetRelativeSpeed(50)\nMessage(\"over TLS\")\n\
                       MoveTo({{400, 60, 350}, {0, 0, -1}, {1, 0, 0}})\nEndCanon(0)\n";

/// Who has a certificate of the authority sends its program; who has none, one of another
/// authority, or speaks in the clear does not get in.
#[test]
fn only_who_has_a_certificate_gets_in() {
    let folder = tempfile::tempdir().unwrap();
    let program = file(&folder, "program.canon", PROGRAM);
    let [server, client, stranger] = ["server", "client", "stranger"].map(|n| signed(&folder, n));
    let [certificate, key, _] = &server;
    let options = ["--tls", certificate, key, &client[2]];
    let scene = Scene::new("tls", &options);
    let address = scene.address().to_string();
    let send = |tls: &[&str]| {
        let fixed = ["crcl", "send", &address, &program];
        command([&fixed, tls].concat()).output().unwrap()
    };
    let sent = send(&["--tls", &client[0], &client[1], &server[2]]);
    let said = String::from_utf8_lossy(&sent.stdout).into_owned();
    assert!(
        sent.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&sent.stderr)
    );
    assert!(said.contains("MoveTo"), "{said}");
    for tls in [
        vec![],
        vec!["--tls", &stranger[0], &stranger[1], &server[2]],
        vec!["--tls", &client[0], &client[1], &stranger[2]],
    ] {
        let refused = send(&tls);
        assert!(!refused.status.success(), "{tls:?} got in");
        assert!(!refused.stderr.is_empty(), "{tls:?} was told nothing");
    }
    // The server is still there for who may come.
    assert!(
        send(&["--tls", &client[0], &client[1], &server[2]])
            .status
            .success()
    );
}
