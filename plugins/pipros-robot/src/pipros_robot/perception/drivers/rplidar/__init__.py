"""The protocol of SLAMTEC's RPLIDARs: requests, samples, and scans of full turns."""
