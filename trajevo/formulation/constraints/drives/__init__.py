"""Limits of drives: torque at speed, root-mean-square torque, temperatures of windings, power of a shared supply."""
