//! The scenarios that come with the product.

/// Names and texts of the shipped scenarios.
pub(super) const SCENARIOS: [(&str, &str); 8] = [
    ("paper", include_str!("../../../../scenarios/paper.toml")),
    (
        "paper-stop-and-go",
        include_str!("../../../../scenarios/paper-stop-and-go.toml"),
    ),
    (
        "paper-real-odometry",
        include_str!("../../../../scenarios/paper-real-odometry.toml"),
    ),
    (
        "paper-real-odometry-2",
        include_str!("../../../../scenarios/paper-real-odometry-2.toml"),
    ),
    (
        "paper-real-odometry-4",
        include_str!("../../../../scenarios/paper-real-odometry-4.toml"),
    ),
    ("yard", include_str!("../../../../scenarios/yard.toml")),
    (
        "nlos-and-faults",
        include_str!("../../../../scenarios/nlos-and-faults.toml"),
    ),
    (
        "campus-handover",
        include_str!("../../../../scenarios/campus-handover.toml"),
    ),
];
