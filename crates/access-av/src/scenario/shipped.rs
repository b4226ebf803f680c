//! The scenarios that come with the product.

/// Names and texts of the shipped scenarios.
pub(super) const SCENARIOS: [(&str, &str); 2] = [
    ("paper", include_str!("../../../../scenarios/paper.toml")),
    (
        "paper-stop-and-go",
        include_str!("../../../../scenarios/paper-stop-and-go.toml"),
    ),
];
