"""SCIP 2, the protocol of Hokuyo's laser scanners: replies, values, and control of the sensor."""
