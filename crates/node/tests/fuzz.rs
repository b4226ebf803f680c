//! Short run of the fuzz target; `fuzz/README.md` describes longer runs.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../../fuzz/bodies/node.rs"]
mod node;
#[path = "../../../fuzz/bodies/short_run.rs"]
mod short_run;

#[test]
fn random_node_inputs_cause_no_panic() {
    let ready = b"\x04\x19\x05READY\x0bSocket-Type\0\0\0\x03REP";
    let greeting = [&b"\xff"[..], &[0; 8], b"\x7f\x03\0NULL", &[0; 48]].concat();
    let seeds = [
        b"\0{\"type\":\"odometry\",\"time_s\":1.5,\"speed_mps\":2}\n{\"type\":\"reset\"}\n".to_vec(),
        b"\0{\"type\":\"angle\",\"time_s\":1,\"pci\":1,\"phase_rad\":0.1,\"phase_sigma_rad\":0.1}".to_vec(),
        [b"\x01", &greeting[..], ready, b"\x01\0\0\x04abcd"].concat(),
        [&b"\x02\x01\x03"[..], &[7; 300]].concat(),
        b"\x03name = \"n\"\nmessages = [\"-\"]\n[samples]\nsource = \"raw\"\naddress = \"-\"\nformat = \"ci8\"\n".to_vec(),
        b"\x04tcp://127.0.0.1:5000".to_vec(),
    ];
    short_run::run(&seeds, 20_000, node::run);
}
