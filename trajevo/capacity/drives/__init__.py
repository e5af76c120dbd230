"""What drives let an arm carry: torque at speed, root-mean-square torque, temperature of windings."""
