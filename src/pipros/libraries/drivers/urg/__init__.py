"""The protocol SCIP 2 of Hokuyo's laser scanners: replies, values, and the sensor."""
