//! Warnings about a model obey the lint levels around them.
#![deny(warnings)]
multibody::mbd_model! {
    urdf = "<robot name='w'><link name='r'/><link name='a'><inertial><mass value='2'/><inertia ixx='1' ixy='0' ixz='0'
            iyy='1' iyz='0' izz='3'/></inertial></link><joint name='j' type='continuous'><parent link='r'/>
            <child link='a'/></joint></robot>",
    name = Odd,
}

fn main() {
    let _ = Odd::new();
}
