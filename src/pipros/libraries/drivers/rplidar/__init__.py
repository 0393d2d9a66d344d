"""The protocol of SLAMTEC's RPLIDARs: requests, samples, and scans, each of which covers a full turn."""
