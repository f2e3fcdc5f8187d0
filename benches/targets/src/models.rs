/// Names and files.
const MODELS: [(&str, &str); 5] = [
    ("double_pendulum", "double_pendulum.toml"),
    ("ur5", "ur5.urdf"),
    ("panda", "panda.urdf"),
    ("solo12", "solo12.urdf"),
    ("chain100", "chain100.toml"),
];
