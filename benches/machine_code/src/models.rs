/// Names, files and whether the base floats.
const MODELS: [(&str, &str, bool); 7] = [
    ("double_pendulum", "double_pendulum.toml", false),
    ("ur5", "ur5.urdf", false),
    ("panda", "panda.urdf", false),
    ("solo12", "solo12.urdf", true),
    ("stewart", "mechanisms/stewart.toml", false),
    ("chain100", "chain100.toml", false),
    ("g1", "g1.urdf", true),
];
