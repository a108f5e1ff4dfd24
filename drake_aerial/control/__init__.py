"""Controllers as LeafSystems: MPC, geometric laws, attitude loop, allocation, take-off. No plant."""
