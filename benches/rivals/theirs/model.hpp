// A Pinocchio model from the plain numbers that models.py writes.
#pragma once
#include <pinocchio/multibody.hpp>

#include <fstream>
#include <stdexcept>
#include <string>

inline pinocchio::Model read_model(const std::string & path)
{
    using namespace pinocchio;
    std::ifstream in(path);
    if (!in) throw std::runtime_error("cannot read " + path);
    Model model;
    int nq, nv, njoints;
    in >> model.name >> nq >> nv >> njoints;
    auto number = [&] { double x; in >> x; return x; };
    Eigen::Vector3d gravity;
    for (int k = 0; k < 3; ++k) gravity[k] = number();
    model.gravity.linear() = gravity;
    for (int i = 1; i < njoints; ++i) {
        std::string name, kind;
        JointIndex parent;
        in >> name >> kind >> parent;
        SE3::Matrix3 rotation;
        Eigen::Vector3d place, axis, com;
        Eigen::Matrix3d inertia;
        for (int k = 0; k < 9; ++k) rotation(k / 3, k % 3) = number();
        for (int k = 0; k < 3; ++k) place[k] = number();
        for (int k = 0; k < 3; ++k) axis[k] = number();
        const double mass = number();
        for (int k = 0; k < 3; ++k) com[k] = number();
        for (int k = 0; k < 9; ++k) inertia(k / 3, k % 3) = number();
        const double armature = number();
        const SE3 placement(rotation, place);
        JointIndex id;
        if (kind == "RX") id = model.addJoint(parent, JointModelRX(), placement, name);
        else if (kind == "RY") id = model.addJoint(parent, JointModelRY(), placement, name);
        else if (kind == "RZ") id = model.addJoint(parent, JointModelRZ(), placement, name);
        else if (kind == "RU") id = model.addJoint(parent, JointModelRevoluteUnaligned(axis), placement, name);
        else if (kind == "FF") id = model.addJoint(parent, JointModelFreeFlyer(), placement, name);
        else throw std::runtime_error("joint " + kind);
        model.appendBodyToJoint(id, Inertia(mass, com, inertia));
        model.armature.segment(model.idx_vs[id], model.nvs[id]).setConstant(armature);
    }
    if (!in || model.nq != nq || model.nv != nv) throw std::runtime_error("cannot make sense of " + path);
    return model;
}
