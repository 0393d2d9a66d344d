"""The programs of `rosrun image_transport …`, on pipros: images as other nodes want them."""
